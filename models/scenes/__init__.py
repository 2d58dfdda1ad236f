"""What stands where: description files, robots, hands, and the plant that answers queries."""
