"""What a state looks like, and how an action would be carried out, without any simulation."""

from diagrams.state_view.posed import StateView, cube_pose
from diagrams.state_view.viewer import FRAME, SPEED, Posture, Preview, Viewer

__all__ = ["FRAME", "SPEED", "Posture", "Preview", "StateView", "Viewer", "cube_pose"]
