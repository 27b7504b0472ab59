"""What this computer has of what the commands need, and what adds the rest."""
