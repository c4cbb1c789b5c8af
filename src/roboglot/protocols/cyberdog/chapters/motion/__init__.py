"""Chapters "motion" and "stairs": servo frames, motions with a result, alignment with stairs."""
