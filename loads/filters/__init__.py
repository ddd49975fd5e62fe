"""Digital filters: random processes, convolution, differentiation and interpolation of sampled signals."""
