from design.anti_windup.compensator import AntiWindup as AntiWindup
from design.auditing.audit_design import Audit as Audit
from design.auditing.audit_design import audit as audit
from design.blocks.block import Block as Block
from design.design_file import Design as Design
from design.design_file import read_design as read_design
