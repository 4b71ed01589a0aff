"""An exercise against its truth at every hop: what was heard, the figures, the result, comparisons."""
