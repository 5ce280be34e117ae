"""Tool: tables of columns -> the frequency response of each test."""
