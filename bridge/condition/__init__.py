"""How the plant is: what is wrong with it, what causes what, and how bad that is for each part. Sans-IO.

One judgement for all who tell people: points, events, log and page.
"""
