"""The vehicle and the contact of wheel and rail. Knows nothing of FMI."""
