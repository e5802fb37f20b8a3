"""What a robot that works with a person needs at a table and in a kitchen: following reaches, and measures of teams."""
