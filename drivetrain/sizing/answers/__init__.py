"""Questions about a sized arm: curves over the task, free ratios, ratio studies, reasons for rejection, cycle time."""
