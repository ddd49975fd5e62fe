"""The paper's digital filters: autoregressive models and interpolation between rates."""
