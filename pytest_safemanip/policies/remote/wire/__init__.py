"""Bytes on the wire: transports, encodings, and arrays out of bytes that somebody else sent."""
