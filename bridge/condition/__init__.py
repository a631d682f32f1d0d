"""Condition of the plant: its troubles, their causes, and their weight for each part. Sans-IO.

One judgement for all who tell people: points, events, log and page.
"""
