"""Panels of many cells: electrodes, cuts, seams and strain on a fabric, solved natively and as netlists."""
