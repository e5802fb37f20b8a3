"""Tests; the folders mirror those of the packages, ``oracles`` and ``support`` hold what several tests share."""
