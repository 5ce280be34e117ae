"""The console command ``antiwindup``: the commands of every room, and builds, which are many of them in order."""
