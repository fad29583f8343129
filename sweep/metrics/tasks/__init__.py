"""What designs are worth for tasks beside the traffic lights; everything is a smooth function of expected electrons."""
