"""The machine book: the folder with the files of all machines, which a person can copy, mail and open."""
