"""Responses of vehicle and track in the frequency domain."""
