"""What FootFall takes and reaches, measured; each module says its command."""

from footfall.processor import choose_arithmetic

choose_arithmetic()
