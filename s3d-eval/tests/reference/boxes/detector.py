"""Runs mmdetection3d's script on detector.json, what `s3d detect` found in rooms of a generated area.

detector.py FOLDER > detector_reference.json, where FOLDER holds its files and iou.so: README.md says how.
"""
import json

import mmdetection3d

case = json.load(open("detector.json"))
rooms = range(len(case["rooms"]))
by_room = lambda rows: [[row for row in rows if row[0] == room] for room in rooms]
numbers = mmdetection3d.evaluate(by_room(case["truth"]), by_room(case["detections"]), case["classes"])
print(json.dumps(numbers, indent=0).replace("NaN", "null"))
