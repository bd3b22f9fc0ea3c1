"""Direct solution of sparse symmetric systems: patterns, orderings, and multifrontal Cholesky."""
