"""How well the whole positioner does what is asked of it when its parameters are not the
nominal ones: yields with confidence intervals, influences, worst cases to replay."""
