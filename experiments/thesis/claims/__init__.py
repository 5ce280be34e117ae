"""Thesis: the ledger of printed statements, each recomputed."""
