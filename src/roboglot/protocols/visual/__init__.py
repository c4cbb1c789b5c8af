"""The visual programming protocol: frames in, feedback, progress and responses out (chapter 0 of the manual).

It has no socket: the CyberDog door carries its frames (codes 2002 and 2001), and whoever else speaks ``FrameRelay``.
"""
