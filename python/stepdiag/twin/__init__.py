"""The twin: a simulated instrument on a virtual machine, behind a socket."""
