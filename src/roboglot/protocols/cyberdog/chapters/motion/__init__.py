"""Chapters "motion" and "stairs": servo frames, motions with a result, standing before stairs."""
