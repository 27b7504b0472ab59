"""The thresholds of a diagnosis by the stage that uses them; `Thresholds` has all of them."""
