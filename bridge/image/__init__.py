"""The process image: points, their quality, their present values."""

from bridge.image.image import Columns, Feed, Image, Reading
from bridge.image.point import DataType, Point, Value
from bridge.image.quality import Quality

__all__ = ["Columns", "DataType", "Feed", "Image", "Point", "Quality", "Reading", "Value"]
