"""Jobs for workers on other machines: through the queue of procrastinate in the database that holds the logs."""
