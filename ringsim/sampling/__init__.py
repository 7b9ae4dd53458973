"""Which samples a campaign has: distributions of inputs and designs over them."""
