"""Damaged files, odd numbers and odd names, given to every command: each is answered or refused in a sentence."""
