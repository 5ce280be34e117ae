"""Thesis: verdicts, figures, ledger and audits on one HTML page."""
