"""Effects concealed in real recordings by deletion and spike-in, and what methods name there."""
