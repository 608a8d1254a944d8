"""What meets at a wheel, bodies in modal form, contact laws: shared by all, and in every FMU."""
