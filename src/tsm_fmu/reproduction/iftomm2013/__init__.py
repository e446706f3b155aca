"""Do et al., IFToMM ISRM 2013: Bouc-Wen-like friction."""
