"""Payloads identified from recordings, and motions that excite them."""
