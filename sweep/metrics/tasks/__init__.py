"""Tasks beside the traffic lights, as smooth functions of expected electrons."""
