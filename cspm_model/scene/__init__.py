"""What tools that draw robots need of a machine: URDF, frames and markers."""
