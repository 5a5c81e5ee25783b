"""Primitive stand-ins for the meshes and textures that RoboCasa downloads.

Everything here is text generation: MuJoCo models made of boxes, spheres and capsules, and
one-colour textures. Nothing of RoboCasa's own assets is contained in it; what it keeps to are
the names and the overall sizes that RoboCasa's code asks for.
"""
