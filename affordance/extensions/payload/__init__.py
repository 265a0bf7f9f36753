"""Identification of payloads from recordings, and motions that excite them."""
