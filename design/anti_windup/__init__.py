"""Tool: compensators theta1, theta2, the criteria that guarantee them, and their optimisation."""
