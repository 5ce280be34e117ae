"""Thesis: the functions that recompute the ledger's rows."""
