from design.anti_windup.compensator import AntiWindup
from design.auditing.audit_design import Audit, audit
from design.blocks.block import Block
from design.chapter_2.design_delay_free import design_delay_free as delay_free
from design.chapters_3_4.design_extended import design_extended as extended
from design.design_file import Design, read_design

__all__ = ["AntiWindup", "Audit", "Block", "Design", "audit", "delay_free", "extended", "read_design"]
