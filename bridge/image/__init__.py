"""The process image: points, their quality, their present values."""

from bridge.image.image import Feed, Image, Reading
from bridge.image.point import DataType, Point, Value
from bridge.image.quality import Quality

__all__ = ["DataType", "Feed", "Image", "Point", "Quality", "Reading", "Value"]
