"""From a study to a folder of SPICE libraries that circuit designers use: strain is an input of the part."""
