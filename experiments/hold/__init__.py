"""The hold test: does the hand keep the cube while the arm swings as fast as it can?"""
