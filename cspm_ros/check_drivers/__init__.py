"""Whether somebody's drivers speak the contract, judged from what they publish."""
