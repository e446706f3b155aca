"""What the runs are: good enough, from where on compared, how dense, what moves in them."""
