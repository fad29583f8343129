"""Commands: each public function of a file is one, with its arguments and options. Heavy imports wait until it runs."""
