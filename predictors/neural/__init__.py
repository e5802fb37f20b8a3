"""Predictors learned by small neural networks: trained with torch, used without it."""
