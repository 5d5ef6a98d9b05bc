"""The filters on raw pictures: the centralised one and a camera on its own."""
