"""A tuning study with everything at its shortest."""

# A trial is a second or two of the robot's time.
SHORT = """
settling: 0.1
approach: 0.3
tail: 0.1
rest_delay: 0.05
sines: {duration: 0.6}
steps: {levels: [0.5], rise: 0.2, hold: 0.2}
chirp: {duration: 0.5, low: 0.5, high: 1.0}
strokes: {count: 1, stroke: 0.3, dwell: 0.1, back: 0.3, pause: 0.1}
trapezoids: {count: 1, ramp: [0.2, 0.3], hold: [0.1, 0.2]}
postures: {count: 1, move: 0.4, hold: 0.3}
search: {population: 4, report_every: 0.4}
"""
