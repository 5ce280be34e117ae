"""An independent referee: seeded random cases of the plant class, and own numerics for what the project says of them.

The project's data classes state a plant and a design, and its public functions are asked for its answers. The answers
they are compared with are computed here, from the numbers in these classes alone, with numpy, scipy, mpmath and numba.
"""
