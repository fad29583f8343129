"""What can be built: families of filters, and spaces of them."""
