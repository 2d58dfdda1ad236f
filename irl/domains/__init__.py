"""Small worlds with known answers, to check the learning on."""
