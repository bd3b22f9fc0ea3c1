"""What every room stands on: errors, frozen results, atomic files, locks, compiled kernels, worker processes."""
