"""The running table: the hand, physics, progress of the task, and the log of reaches."""
