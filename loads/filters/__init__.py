<<<<<<< HEAD
"""The paper's digital filters: autoregressive models and interpolation between rates."""
=======
"""Digital filters: random processes, convolution, differentiation and interpolation of sampled signals."""
>>>>>>> digital-filters
