"""What the robot works out of a mirror by itself; arrays alone, no Drake."""
