"""LinuxCNC without a screen, run by a program."""
