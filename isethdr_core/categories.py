"""Category names and numbers: COCO's where COCO has the class, ours from 1000."""

CATEGORIES = {
    "none": 0, "person": 1, "bicycle": 2, "car": 3, "motorcycle": 4, "bus": 6, "truck": 8,
    "traffic light": 10, "stop sign": 13, "dog": 18, "horse": 19,
    "deer": 1000, "road": 1001, "tree": 1002, "street lamp": 1003, "guard rail": 1004, "building": 1005,
    "vegetation": 1006, "post": 1007, "tunnel": 1008, "own vehicle": 1009, "sign": 1010, "chart": 1011,
}
