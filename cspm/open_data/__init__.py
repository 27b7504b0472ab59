"""Recordings of others that their licences let anyone use, fetched from the publisher."""
