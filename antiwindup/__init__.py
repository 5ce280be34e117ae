"""The console command: builds, and the commands of every room."""


def main() -> None:
    """Run the command of this process, which is settled before anything slow is imported."""
    from identification.base.process import begin

    begin()
    from antiwindup.__main__ import main as commands

    commands()
