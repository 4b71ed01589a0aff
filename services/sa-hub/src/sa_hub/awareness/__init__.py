"""What a hub makes of its picture: who knows whom, how well nets keep it right, and who is in danger."""
